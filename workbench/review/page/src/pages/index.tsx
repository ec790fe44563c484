/** The dialogs over the page and the pages beside the review itself. */
import { dialog, page, session } from "../state/state";
import { AccountsDialog } from "./accounts_dialog";
import { AdjudicationPage } from "./adjudication_page";
import { CodingDialog } from "./coding_dialog";
import { ElanDialog } from "./elan_dialog";
import { ManualPanel } from "./manual_panel";
import { OverviewPage } from "./overview_page";
import { PublishDialog } from "./publish_dialog";
import { SchemeDialog } from "./scheme_dialog";
import { SettingsDialog } from "./settings_dialog";
import "./pages.css";

/** The open dialog; the help belongs to the keyboard. What only a lead may do, nobody else is shown. */
export function Dialogs() {
  const isLead = session.value?.is_lead === true;
  switch (dialog.value) {
    case "publish": return <PublishDialog />;
    case "manual": return <ManualPanel />;
    case "scheme": return <SchemeDialog />;
    case "elan": return <ElanDialog />;
    case "settings": return <SettingsDialog />;
    case "coding": return isLead ? <CodingDialog /> : null;
    case "accounts": return isLead ? <AccountsDialog /> : null;
    default: return null;
  }
}

/** The overview or the adjudication, where one of them is shown; nothing while people review. */
export function Pages() {
  if (session.value?.is_lead !== true) return null;
  switch (page.value) {
    case "overview": return <OverviewPage />;
    case "adjudication": return <AdjudicationPage />;
    default: return null;
  }
}
